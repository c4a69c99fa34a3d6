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

_SHARE_OF_COLOUR = """async ([png, colour]) => {
  const image = new Image();
  image.src = 'data:image/png;base64,' + png;
  await image.decode();
  const canvas = Object.assign(document.createElement('canvas'), {width: image.width, height: image.height});
  const context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  const { data } = context.getImageData(0, 0, image.width, image.height);
  const wanted = colour.match(/\\d+/g).map(Number);
  let found = 0;
  for (let at = 0; at < data.length; at += 4)
    if (wanted.every((value, channel) => Math.abs(data[at + channel] - value) <= 8)) found++;
  return found / (data.length / 4);
}"""


async def colours(shown: Locator) -> int:
    """How many different colours an element has on the screen. A canvas on which nothing is drawn has one."""
    png = base64.b64encode(await shown.screenshot()).decode()
    count: int = await shown.page.evaluate(_COUNT_COLOURS, png)
    return count


async def share_of_colour(shown: Locator, colour: str) -> float:
    """How much of an element's screen has about this colour ("rgb(74, 96, 119)"), from 0 to 1."""
    png = base64.b64encode(await shown.screenshot()).decode()
    share: float = await shown.page.evaluate(_SHARE_OF_COLOUR, [png, colour])
    return share
