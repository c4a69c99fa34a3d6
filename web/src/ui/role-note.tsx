/** Why something is shown and cannot be used; nothing if there is no such reason. */
export function RoleNote({ children }: { children: string | null }) {
  if (children === null) return null;
  return (
    <p class="role-note" role="note">
      {children}
    </p>
  );
}
