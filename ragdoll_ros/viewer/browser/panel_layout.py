"""Where the panel stands: beside the picture, or on a narrow screen as a sheet below it."""
from __future__ import annotations

NARROW = '36em'
"""Width below which viser itself makes the panel a sheet."""

SHEET = '45%'
"""Most of the height that the sheet takes."""

FREE = f"""<style>
  @media (max-width: {NARROW}) {{
    .ragdoll-sheet, .ragdoll-sheet [style*='width: 20em'] {{width: 100% !important}}
    .ragdoll-sheet {{max-height: {SHEET} !important}}
  }}
</style><img src="data:," style="display:none" onerror="
  let sheet = this.parentElement;
  while (sheet && getComputedStyle(sheet).position !== 'fixed') sheet = sheet.parentElement;
  const picture = sheet?.previousElementSibling;
  if (picture?.querySelector('canvas')) {{
    sheet.classList.add('ragdoll-sheet');
    const fit = () => {{
      picture.style.height = sheet.isConnected ? `calc(100% - ${{sheet.offsetHeight}}px)` : '100%';
    }};
    new ResizeObserver(fit).observe(sheet);
    fit();
  }}">"""
"""Leaves the picture what the sheet does not cover, so that its middle is the middle of what is
seen. Beside a docked panel viser does so itself."""
