"""The ground under every other browser test: WebGL 2 runs here, so the map can draw."""

from __future__ import annotations

from playwright.async_api import Browser

DRAW_ONE_PIXEL = """() => {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return null;
  gl.clearColor(1, 0.5, 0, 1);
  gl.clear(gl.COLOR_BUFFER_BIT);
  const pixel = new Uint8Array(4);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  return Array.from(pixel);
}"""


async def test_webgl_2_draws_in_this_chromium(browser: Browser) -> None:
    page = await browser.new_page()
    assert await page.evaluate(DRAW_ONE_PIXEL) == [255, 128, 0, 255]
    await page.close()
