"""Pictures a second of the page in Chromium, by size of the window, and what limits them.

    python test/page_pictures.py

Each picture that the browser has a chance for is drawn, as while a doll moves. Without a GPU the
processor draws: beside the rate is what a picture takes of one core, ms, which depends less on what
else the machine does; its load is printed.
"""
from __future__ import annotations

import argparse
import os
import re
import tempfile
import time
from pathlib import Path

from browser import READY, chromium, serving
from page_cost import spinning

SIZES = ((1280, 800), (1440, 900), (2560, 1440))

KINDS = {'all': (True, 1.0), 'no shadows': (False, 1.0), '60 %': (False, 0.6),
         '40 %': (False, 0.4)}
"""Whether there are shadows, and the share of the window's pixels each way: the page's levels."""

COUNT = """async ([shadows, share, seconds]) => {
  window.ragdollKeepsQuality = true;
  const viewer = window.__viserMutable, root = viewer.scene.__r3f.root.getState();
  const set = () => {
    for (const light of viewer.scene.children) if (light.shadow) light.castShadow = shadows;
    if (root.viewport.dpr !== share) root.setDpr(share);
    viewer.requestRender();
  };
  const count = async (duration) => {
    const {render} = root.gl.info, [begin, before] = [performance.now(), render.frame];
    while (performance.now() < begin + 1000 * duration) {
      set();
      await new Promise(requestAnimationFrame);
    }
    return (render.frame - before) / (performance.now() - begin) * 1000;
  };
  const rate = await count(seconds);
  return [rate, root.gl.info.render.calls, root.gl.info.render.triangles];
}"""

NOTE = "document.querySelector('.ragdoll-quality')?.textContent || ''"


def browser_time() -> float:
    """CPU s of this process's browser, of all its processes."""
    parents, shares = {}, {}
    for folder in Path('/proc').glob('[0-9]*'):
        try:
            pid, name, rest = re.match(r'(\d+) \((.*)\) (.*)', (folder / 'stat').read_text(),
                                       re.DOTALL).groups()
        except OSError:  # has ended
            continue
        fields = rest.split()
        parents[int(pid)] = int(fields[1])
        if 'chrom' in name:
            shares[int(pid)] = (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')

    def is_ours(pid: int) -> bool:
        return pid == os.getpid() or (pid in parents and is_ours(parents[pid]))

    return sum(share for pid, share in shares.items() if is_ours(pid))


def rates(context, url: str, size: tuple[int, int], seconds: float) -> list[str]:
    """A row's cells: the rates of each kind, and what the page itself did about them."""
    page = context.new_page()
    page.set_viewport_size({'width': size[0], 'height': size[1]})
    page.goto(url)
    page.wait_for_function(READY)
    page.wait_for_timeout(4000)  # all is loaded and drawn
    cells = []
    for shadows, share in KINDS.values():
        page.evaluate(COUNT, [shadows, share, seconds / 4])  # shaders are compiled
        before, begun = browser_time(), time.monotonic()
        rate, calls, triangles = page.evaluate(COUNT, [shadows, share, seconds])
        cost = (browser_time() - before) / rate / (time.monotonic() - begun)
        cells.append(f'{rate:.1f}, {1000 * cost:.0f} ms')
    cells.append(f'{calls} / {triangles / 1000:.0f}k')
    page.evaluate('window.ragdollKeepsQuality = false')
    page.evaluate("""() => (function draw() {
      window.__viserMutable.requestRender(); requestAnimationFrame(draw); })()""")
    end = time.monotonic() + 30
    page.wait_for_timeout(6000)
    while (note := page.evaluate(NOTE)) == '' and time.monotonic() < end:
        page.wait_for_timeout(500)
    page.close()
    return [*cells, note or 'as it was']


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=4.0, help='of each measurement (4)')
    options = parser.parse_args()
    print('| scene | window | ' + ' | '.join(KINDS) + ' | draws / triangles | the page |')
    with tempfile.TemporaryDirectory() as folder:
        scenes = {'drop': 'drop', 'a fitted character': 'character_falls',
                  '50 dolls': str(spinning(50, Path(folder) / 'spinning.yaml'))}
        for label, scene in scenes.items():
            with (serving('--port', '0', '--scene', scene) as url,
                  chromium(draws=True, sharpness=1.0) as context):
                for size in SIZES:
                    cells = rates(context, url, size, options.seconds)
                    print(f'| {label} | {size[0]} x {size[1]} | ' + ' | '.join(cells) + ' |'
                          f' load {os.getloadavg()[0]:.0f}', flush=True)


if __name__ == '__main__':
    main()
