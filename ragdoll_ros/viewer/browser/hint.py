"""What can be done on a page: said above its panel until it is closed, once in a browser."""
from __future__ import annotations

OF_DOLL = ('Drag a bone. Arrow keys push: tap or hold. Space pauses, R starts again, E edits, '
           'H brings the view home.')

OF_RECORDING = ('A recorded run. Space pauses, R starts again, drag Time or press J, K, L to look '
                'back, H brings the view home.')


def hint(words: str, name: str) -> str:
    """HTML of a hint, closed for good in a browser by a name of its own."""
    return f"""<div class="ragdoll-hint" style="display: flex; gap: 0.5em; font-size: 0.85em;
    margin: 0.6em 0.8em 0.2em; padding: 0.4em 0.6em; border-left: 3px solid #228be6;
    background: rgba(34, 139, 230, 0.08)">
  <span>{words}</span>
  <button aria-label="Close the hint" style="border: 0; background: none; color: inherit;
      cursor: pointer; font-size: 1.2em; align-self: start" onclick="
    localStorage.{name} = 'closed';
    this.parentElement.style.display = 'none'">&times;</button>
</div><img src="data:," style="display:none" onerror="
  if (localStorage.{name}) this.previousElementSibling.style.display = 'none'">"""
