#!/usr/bin/env python3
"""Pictures of a report for the documentation: `tools/screenshots.py [RUN_DIRECTORY [FOLDER]]`.

Needs Chromium, and a finished run with its report.html (default configs/runs/shield). Writes report_desktop.png and
report_phone.png into the folder (default docs/images).
"""

import sys
from pathlib import Path

from chromium import Browser, program

REPOSITORY = Path(__file__).resolve().parent.parent


def main():
    arguments = [Path(argument) for argument in sys.argv[1:]]
    run = arguments[0] if arguments else REPOSITORY / "configs/runs/shield"
    folder = arguments[1] if len(arguments) > 1 else REPOSITORY / "docs/images"
    page = run / "report.html"
    if not page.is_file():
        sys.exit(f"{page} is not there: run `fluxmorph report {run}` first")
    if program() is None:
        sys.exit("Chromium is not installed")
    with Browser() as browser:
        browser.show(page, 1100, 900)
        browser.screenshot(folder / "report_desktop.png", (0, 0, 1100, 1640))
        browser.show(page, 390, 844, 2, mobile=True)
        browser.screenshot(folder / "report_phone.png", (0, 0, 390, 1480))
    for name in ["report_desktop.png", "report_phone.png"]:
        print(f"{folder / name}: {(folder / name).stat().st_size // 1024} kB")


main()
