"""Looks at a report in headless Chromium: `browser.py REPORT.html`, with tools/ in PYTHONPATH.

Light and dark, desktop and phone: no complaint of the console, nothing asked from a network, every figure with a size, no
page wider than its window. The view in three dimensions draws something, turns with mouse and keys, and follows its slider.
"""

import sys

from chromium import Browser

FIGURES = """[...document.querySelectorAll('figure')].map(f => ({
  name: f.id || f.dataset.chart,
  sizes: [...f.querySelectorAll('svg, canvas')].filter(e => !e.closest('.stage svg')).map(e => {
    const box = e.getBoundingClientRect();
    return [box.width, box.height];
  }),
}))"""

# Share of the pixels of the canvas that are drawn, and a sum that changes with the picture.
PIXELS = """(() => {
  const canvas = document.querySelector('canvas');
  const gl = canvas.getContext('webgl2');
  const data = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, data);
  let drawn = 0, sum = 0;
  for (let i = 0; i < data.length; i += 4) {
    drawn += data[i + 3] > 0;
    sum = (sum * 31 + data[i] + 3 * data[i + 1] + 7 * data[i + 2]) % 1000003;
  }
  return [drawn / (data.length / 4), sum, new Set(data).size];
})()"""

CENTRE = """(() => {
  const canvas = document.querySelector('canvas');
  canvas.scrollIntoView({ block: 'center', behavior: 'instant' });
  const box = canvas.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
})()"""


def check(browser, page, width, height, mobile, dark):
    where = f"{width} px, {'dark' if dark else 'light'}"
    browser.show(page, width, height, 2 if mobile else 1, mobile, dark)
    figures = browser.value(FIGURES)
    assert len(figures) >= 6, figures
    for figure in figures:
        assert figure["sizes"], f"{where}: {figure['name']} is empty"
        for size in figure["sizes"]:
            assert min(size) > 40, f"{where}: {figure['name']} has the size {size}"
    reach = browser.value("Math.max(document.documentElement.scrollWidth, document.body.scrollWidth)")
    assert reach <= width, f"{where}: the page is {reach} px wide"
    broken = browser.value("[...document.querySelectorAll('image')].filter(i => i.getBoundingClientRect().width < 40).length")
    assert broken == 0, f"{where}: {broken} images without size"
    assert browser.value("document.querySelector('.no-view').offsetHeight") == 0, f"{where}: no WebGL"
    drawn, _, colours = browser.value(PIXELS)
    assert drawn > 0.1 and colours > 20, f"{where}: the view is blank: {drawn}, {colours}"
    print(f"{where}: {len(figures)} figures, the view covers {100 * drawn:.0f} % of its stage")


def interact(browser, page):
    browser.show(page, 1100, 900)
    x, y = browser.value(CENTRE)
    pictures = [browser.value(PIXELS)[1]]

    def changed(what):
        browser.frames()
        now = browser.value(PIXELS)[1]
        assert now != pictures[-1], f"the view does not change with {what}"
        pictures.append(now)

    browser.drag((x, y), (x + 120, y + 40))
    changed("a drag")
    browser.value("document.querySelector('canvas').focus()")
    browser.key("ArrowLeft")
    changed("an arrow key")
    browser.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-300)
    changed("the wheel")
    slide = "const s = document.querySelector('input[type=range]'); s.value = 0; s.dispatchEvent(new Event('input'));"
    browser.value(f"(() => {{ {slide} }})()")
    changed("the slider")
    for colour in range(1, browser.value("document.querySelector('.controls select').options.length")):
        choose = f"const s = document.querySelector('.controls select'); s.value = {colour}; s.dispatchEvent(new Event('change'));"
        browser.value(f"(() => {{ {choose} }})()")
        changed(f"colour {colour}")
    browser.key("Home")
    changed("the key Home")
    print(f"the view answers: {len(pictures)} different pictures")


def main(page):
    with Browser() as browser:
        for width, height, mobile in [(1100, 900, False), (390, 844, True)]:
            for dark in (False, True):
                check(browser, page, width, height, mobile, dark)
        interact(browser, page)
        complaints = browser.complaints()
        assert not complaints, complaints
    print("OK")


main(sys.argv[1])
