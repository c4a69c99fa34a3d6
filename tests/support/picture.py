"""What a screenshot shows, counted in the browser itself."""

from __future__ import annotations

import base64

from playwright.async_api import Locator

_COUNT_COLOURS = """async (png) => {
  const image = new Image();
  image.src = 'data:image/png;base64,' + png;
  await image.decode();
  const canvas = Object.assign(document.createElement('canvas'), {width: image.width, height: image.height});
  const context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  const pixels = new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer);
  return new Set(pixels).size;
}"""


async def colours(shown: Locator) -> int:
    """How many different colours an element has on the screen. A canvas on which nothing is drawn has one."""
    png = base64.b64encode(await shown.screenshot()).decode()
    count: int = await shown.page.evaluate(_COUNT_COLOURS, png)
    return count
