"""What a page says once whoever served it is gone: viser itself only dims the panel."""
from __future__ import annotations

WORDS = ('The viewer that served this page has ended, or cannot be reached: start it again at the '
         'same port, and the page goes on by itself.')

PATIENCE = 2.0
"""s without a line before it is said: a network that stumbles comes back sooner."""

LOST = f"""<style>
  @keyframes ragdoll-lost {{to {{visibility: visible}}}}
  body:has(.mantine-Loader-root[style*='position: absolute'])::before {{
    content: '{WORDS}';
    position: fixed; z-index: 1000; top: 0.8em; left: 0.8em; max-width: min(30em, 60vw);
    padding: 0.6em 0.9em; border-left: 3px solid #e03131; border-radius: 2px;
    background: #fff5f5; color: #862e2e; font: 0.9em sans-serif;
    visibility: hidden; animation: ragdoll-lost 0s {PATIENCE:g}s forwards;
  }}
</style>"""
"""While a page has no line to its server, viser shows three dots beside its name: a Loader, which
is the only one placed so."""
