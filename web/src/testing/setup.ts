/**
 * What modules look for as they are imported, for tests in Node: an address, storage, and a system that prefers the
 * dark.
 */

class Memory {
  readonly #values = new Map<string, string>();
  getItem = (key: string): string | null => this.#values.get(key) ?? null;
  setItem = (key: string, value: string): void => void this.#values.set(key, value);
  removeItem = (key: string): void => void this.#values.delete(key);
}

Object.assign(globalThis, {
  location: { hash: "", href: "http://page.test/", origin: "http://page.test" },
  sessionStorage: new Memory(),
  localStorage: new Memory(),
  matchMedia: () => ({ matches: true, addEventListener: () => undefined }),
});
