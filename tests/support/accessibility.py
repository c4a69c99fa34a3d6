"""What axe finds wrong with the page as it is, in both themes, from a telephone to a wall of 4K."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from playwright.async_api import Page, ViewportSize

from tests.support.paths import ROOT

AXE: Final = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
DESKTOP: Final[ViewportSize] = {"width": 1440, "height": 900}
PHONE: Final[ViewportSize] = {"width": 360, "height": 800}
WALL_DISPLAY: Final[ViewportSize] = {"width": 3840, "height": 2160}

FIND: Final = """async () => {
  const { dataset } = document.documentElement, theme = dataset.theme, found = [];
  const looks = [[theme, {}], [theme === 'dark' ? 'light' : 'dark', { runOnly: ['color-contrast'] }]];
  // The attribute alone changes all colours of the style sheet, and the map need not be drawn anew for it.
  for (const [other, options] of looks) {
    dataset.theme = other;
    const { violations } = await axe.run(document, { resultTypes: ['violations'], ...options });
    found.push(...violations.map(v => [other, v.id, ...v.nodes.map(n => n.html + ' ' + n.failureSummary)].join(' ')));
  }
  dataset.theme = theme;
  return found;
}"""


async def violations(page: Page, where: str, sizes: Sequence[ViewportSize] = (DESKTOP, PHONE)) -> list[str]:
    """All that axe finds, with where it is: every rule, and in the other theme the colours. The page keeps its size."""
    if not await page.evaluate("() => 'axe' in window"):
        await page.evaluate(AXE.read_text())
    before = page.viewport_size
    assert before is not None
    found: list[str] = []
    for size in sizes:
        if page.viewport_size != size:
            await page.set_viewport_size(size)
        found += [f"{where}, {size['width']} px, {one}" for one in await page.evaluate(FIND)]
    if page.viewport_size != before:
        await page.set_viewport_size(before)
    return found
