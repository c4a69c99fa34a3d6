"""What axe finds wrong with the page as it is, in both themes, on a desk and on a telephone."""

from __future__ import annotations

from typing import Final

from playwright.async_api import Page

from tests.browser.dashboard import ROOT, Scheme

AXE: Final = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
SIZES: Final = ({"width": 1440, "height": 900}, {"width": 360, "height": 800})
SCHEMES: Final[tuple[Scheme, ...]] = ("dark", "light")
FIND: Final = """async options => {
  const found = await axe.run(document, { resultTypes: ['violations'], ...options });
  return found.violations.map(v => [v.id, ...v.nodes.map(n => n.html + ' ' + n.failureSummary)]);
}"""
COLOURS_ALONE: Final = {"runOnly": ["color-contrast"]}
"""All else is the same in another theme."""


async def violations(page: Page, where: str) -> list[str]:
    """All that axe finds, with where it is. The page keeps its size and theme."""
    if not await page.evaluate("() => 'axe' in window"):
        await page.evaluate(AXE.read_text())
    size, scheme = page.viewport_size, "dark" if await _is_dark(page) else "light"
    assert size is not None
    found: list[str] = []
    for other in SIZES:
        await page.set_viewport_size({"width": other["width"], "height": other["height"]})
        for theme in SCHEMES:
            await page.emulate_media(color_scheme=theme)
            await page.wait_for_function("theme => document.documentElement.dataset.theme === theme", arg=theme)
            options = {} if theme == "dark" else COLOURS_ALONE
            found += [f"{where}, {other['width']} px, {theme}: {one}" for one in await page.evaluate(FIND, options)]
    await page.set_viewport_size(size)
    await page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    return found


async def _is_dark(page: Page) -> bool:
    return bool(await page.evaluate("() => document.documentElement.dataset.theme === 'dark'"))
