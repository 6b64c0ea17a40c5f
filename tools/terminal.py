#!/usr/bin/env python3
"""Runs a program on a pseudo-terminal, and draws what stands on its screen as SVG.

    tools/terminal.py --svg docs/images/terminal.svg --at "3/5 [" -- target/release/fluxmorph run configs/shield_quick.toml

draws two screens: as soon as the text of --at stands there, and at the end. Understood of the terminal's language is
what the program speaks: line feeds, carriage returns, erasing of lines, movements of the cursor, colours.
With --raw the bytes go to standard output as they come, and the exit code is the program's.
Needs nothing but Python 3 on a system with pseudo-terminals.
"""

import argparse
import codecs
import fcntl
import html
import os
import pty
import re
import select
import struct
import sys
import termios
import time

COLOURS = {31: "#f7768e", 32: "#9ece6a", 33: "#e0af68", 34: "#7aa2f7", 35: "#bb9af7", 36: "#7dcfff"}
FOREGROUND, BACKGROUND, FAINT = "#c8d3f5", "#1b1d2b", "#7c86a8"
SEQUENCE = re.compile(r"\x1b\[([?0-9;]*)([A-Za-z])")


class Screen:
    """The cells of a terminal: lists of (character, style)."""

    def __init__(self, columns, rows):
        self.columns, self.rows = columns, rows
        self.lines, self.row, self.column = [[]], 0, 0
        self.style = (None, False, False)
        self.rest = ""

    def feed(self, text):
        text, self.rest = self.rest + text, ""
        place = 0
        while place < len(text):
            if text[place] == "\x1b":
                match = SEQUENCE.match(text, place)
                if match is None:
                    if len(text) - place < 12:
                        self.rest = text[place:]
                        return
                    place += 1
                    continue
                self.control(match.group(1), match.group(2))
                place = match.end()
                continue
            self.put(text[place])
            place += 1

    def put(self, character):
        if character == "\r":
            self.column = 0
        elif character == "\n":
            self.row += 1
        elif character >= " ":
            if self.column == self.columns:
                self.row, self.column = self.row + 1, 0
            self.reach()
            self.lines[self.row][self.column] = (character, self.style)
            self.column += 1
        while len(self.lines) <= self.row:
            self.lines.append([])

    def reach(self):
        while len(self.lines) <= self.row:
            self.lines.append([])
        line = self.lines[self.row]
        line.extend([(" ", (None, False, False))] * (self.column + 1 - len(line)))

    def control(self, parameters, letter):
        numbers = [int(n) for n in re.findall(r"\d+", parameters)]
        count = numbers[0] if numbers else 1
        if letter == "m":
            for n in numbers or [0]:
                colour, bold, faint = self.style
                if n == 0:
                    colour, bold, faint = None, False, False
                elif n == 1:
                    bold = True
                elif n == 2:
                    faint = True
                elif n in COLOURS:
                    colour = n
                elif n - 60 in COLOURS:
                    colour = n - 60
                elif n == 39:
                    colour = None
                self.style = (colour, bold, faint)
        elif letter == "K":
            whole = numbers[:1] == [2]
            del self.lines[self.row][0 if whole else self.column :]
        elif letter == "J":
            del self.lines[self.row][self.column :]
            del self.lines[self.row + 1 :]
        elif letter == "A":
            self.row = max(0, self.row - count)
        elif letter == "B":
            self.row += count
            self.reach()
        elif letter == "C":
            self.column = min(self.columns - 1, self.column + count)
        elif letter == "D":
            self.column = max(0, self.column - count)
        elif letter == "G":
            self.column = min(self.columns, count) - 1

    def text(self):
        return "\n".join("".join(cell[0] for cell in line) for line in self.lines)

    def shown(self):
        """The lines that are on the screen, without empty ones at the end."""
        lines = [list(line) for line in self.lines[-self.rows :]]
        while lines and not "".join(cell[0] for cell in lines[-1]).strip():
            lines.pop()
        return lines


def run(command, columns, rows, hear, raw=False, interrupt_at=""):
    """Runs a command on a terminal; `hear` is told every piece of text. The exit code."""
    parent, child = pty.openpty()
    fcntl.ioctl(child, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    process = os.fork()
    if process == 0:
        os.close(parent)
        os.setsid()
        fcntl.ioctl(child, termios.TIOCSCTTY, 0)
        for stream in range(3):
            os.dup2(child, stream)
        os.close(child)
        try:
            os.execvp(command[0], command)
        except OSError as error:
            print(f"{command[0]}: {error.strerror}", file=sys.stderr)
            os._exit(127)
    os.close(child)
    decoder = codecs.getincrementaldecoder("utf-8")("replace")
    heard = ""
    while True:
        ready, _, _ = select.select([parent], [], [], 600)
        try:
            piece = os.read(parent, 65536) if ready else b""
        except OSError:
            piece = b""
        if not piece:
            break
        text = decoder.decode(piece)
        heard += text
        if interrupt_at and interrupt_at in heard:
            os.write(parent, b"\x03")
            interrupt_at = ""
        if raw:
            sys.stdout.write(text)
        hear(text)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def svg(screens, columns):
    """Screens, each with a title, one under the other."""
    width, height, margin = 8.43, 18, 16
    wide = columns * width + 2 * margin
    parts, y = [], margin
    for title, lines in screens:
        tall = len(lines) * height + 46
        parts.append(f'<rect x="{margin}" y="{y}" width="{wide}" height="{tall}" rx="8" fill="{BACKGROUND}"/>')
        for k, colour in enumerate(("#ff5f57", "#febc2e", "#28c840")):
            parts.append(f'<circle cx="{margin + 18 + 18 * k}" cy="{y + 15}" r="5.5" fill="{colour}"/>')
        parts.append(f'<text x="{margin + wide / 2}" y="{y + 20}" class="t">{html.escape(title)}</text>')
        for k, line in enumerate(lines):
            parts.append(line_of(line, 2 * margin, y + 46 + k * height, width))
        y += tall + margin
    style = (
        "text{font:14px 'DejaVu Sans Mono',Menlo,Consolas,monospace;white-space:pre;fill:%s}"
        ".t{font-size:12px;text-anchor:middle;fill:%s}" % (FOREGROUND, FAINT)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide + 2 * margin:.0f}" height="{y:.0f}" '
        f'viewBox="0 0 {wide + 2 * margin:.0f} {y:.0f}">\n<style>{style}</style>\n' + "\n".join(parts) + "\n</svg>\n"
    )


def line_of(line, x, y, width):
    """A line of cells: one text element for each run of the same style, so that columns stay columns."""
    runs, start = [], 0
    for place in range(1, len(line) + 1):
        if place == len(line) or line[place][1] != line[start][1]:
            runs.append((start, "".join(cell[0] for cell in line[start:place]), line[start][1]))
            start = place
    texts = []
    for start, text, (colour, bold, faint) in runs:
        if text.strip():
            fill = COLOURS.get(colour) or (FAINT if faint else None)
            rules = (f"fill:{fill};" if fill else "") + ("font-weight:bold" if bold else "")
            attributes = f' style="{rules}"' if rules else ""
            length = f"{len(text) * width:.1f}"
            texts.append(
                f'<text x="{x + start * width:.1f}" y="{y:.1f}" textLength="{length}" xml:space="preserve"{attributes}>'
                f"{html.escape(text)}</text>"
            )
    return "".join(texts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--columns", type=int, default=110)
    parser.add_argument("--rows", type=int, default=30)
    parser.add_argument("--svg", help="file to draw into")
    parser.add_argument("--at", default="", help="text of the first screen to draw")
    parser.add_argument("--shown-as", help="the command as the picture shows it")
    parser.add_argument("--raw", action="store_true", help="pass the bytes on")
    parser.add_argument("--interrupt-at", default="", help="send Ctrl-C when this text has come")
    parser.add_argument("command", nargs="+")
    arguments = parser.parse_args()
    command = arguments.command
    screen, screens = Screen(arguments.columns, arguments.rows), []
    prompt = "\x1b[32m$\x1b[0m " + (arguments.shown_as or " ".join(command)) + "\r\n"
    screen.feed(prompt)
    began = time.monotonic()

    def hear(text):
        # A picture says nothing of the machine that it was made on.
        text = text.replace(os.getcwd() + os.sep, "")
        # Piece by piece, since the text looked for may stand only for a moment.
        for piece in re.split(r"(?<=\r)(?!\n)|(?=\x1b\[2K)", text):
            screen.feed(piece)
            if arguments.at and not screens and arguments.at in screen.text():
                screens.append((f"after {time.monotonic() - began:.1f} s", screen.shown()))

    code = run(command, arguments.columns, arguments.rows, hear, arguments.raw, arguments.interrupt_at)
    if arguments.svg:
        screens.append(("at the end", screen.shown()))
        folder = os.path.dirname(arguments.svg)
        if folder:
            os.makedirs(folder, exist_ok=True)
        with open(arguments.svg, "w", encoding="utf-8") as file:
            file.write(svg(screens, arguments.columns))
    sys.stdout.flush()
    sys.exit(code)


if __name__ == "__main__":
    main()
