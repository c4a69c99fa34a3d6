import { Icon, type IconName } from "../../ui/icons";

interface MapToolProps {
  icon: IconName;
  label: string;
  pressed?: boolean;
  onClick: () => void;
}

export function MapTool({ icon, label, pressed, onClick }: MapToolProps) {
  return (
    <button type="button" class="icon-button" aria-label={label} title={label} aria-pressed={pressed} onClick={onClick}>
      <Icon name={icon} />
    </button>
  );
}
