"""Open a page in a browser and watch what it does: words on the console, errors, requests, dialogues."""

from contextlib import contextmanager
from pathlib import Path

#: Where pictures of pages are kept, for whoever wants to see them.
PICTURES = Path(__file__).parents[2] / "out" / "pages"

#: Text whose contrast with what lies behind it is below what WCAG 2 AA asks, [(text, ratio)]; canvases are not seen.
CONTRAST = """() => {
  const paint = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (text) => {
    paint.clearRect(0, 0, 1, 1);
    paint.fillStyle = text;
    paint.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = paint.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const light = (rgb) => {
    const [r, g, b] = rgb.map((v) => { v /= 255; return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const over = (top, below) => [0, 1, 2].map((i) => top[3] * top[i] + (1 - top[3]) * below[i]);
  const behind = (element) => {
    const layers = [];
    for (let at = element; at; at = at.parentElement) layers.unshift(rgba(getComputedStyle(at).backgroundColor));
    return layers.reduce((below, top) => over(top, below), [255, 255, 255]);
  };
  const weak = [];
  let seen = 0;
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = texts.nextNode(); node; node = texts.nextNode()) {
    const element = node.parentElement;
    if (!node.textContent.trim() || element.closest("script, style, noscript, svg, option")) continue;
    if (!element.checkVisibility()) continue;
    const style = getComputedStyle(element);
    const ground = behind(element);
    const a = light(over(rgba(style.color), ground)), b = light(ground);
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    seen++;
    if (ratio < (large ? 3 : 4.5)) weak.push([node.textContent.trim().slice(0, 60), ratio]);
  }
  return [seen, weak];
}"""


@contextmanager
def opened(browser, path, *, width=1280, scheme="light", scripts=True):
    """Open a page; on leaving, nothing may have been said, asked for or gone wrong."""
    window = {"width": width, "height": 900}
    context = browser.new_context(viewport=window, color_scheme=scheme, java_script_enabled=scripts)
    page, told, asked = context.new_page(), [], []
    page.on("console", lambda message: told.append((message.type, message.text)))
    page.on("pageerror", lambda error: told.append(("error", str(error))))
    page.on("dialog", lambda dialog: (told.append(("dialog", dialog.message)), dialog.dismiss()))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(path.as_uri())
    if scripts and page.evaluate("document.getElementById('data') !== null"):
        page.wait_for_selector("html[data-ready]", timeout=20_000)
    yield page
    context.close()
    assert told == []
    assert asked == [path.as_uri()]


def until(page, condition):
    """Wait until an expression is true; the policy of a page forbids the way of `wait_for_function`."""
    for _ in range(200):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"never: {condition}")


def keep(page, name):
    """Keep a picture of a page."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=PICTURES / f"{name}.png", full_page=True)


def legible(page, width):
    """Demand that nothing runs out of the window, and that all text stands out from what lies behind it."""
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    seen, weak = page.evaluate(CONTRAST)
    assert seen > 20
    assert weak == []
