"""What can be done on a page: said above its panel until it is closed, once in a browser."""
from __future__ import annotations

WORDS = ('Drag a bone. Arrow keys push: tap or hold. Space pauses, R starts again, E edits, '
         'H brings the view home.')

HINT = f"""<div class="ragdoll-hint" style="display: flex; gap: 0.5em; font-size: 0.85em;
    margin: 0.6em 0.8em 0.2em; padding: 0.4em 0.6em; border-left: 3px solid #228be6;
    background: rgba(34, 139, 230, 0.08)">
  <span>{WORDS}</span>
  <button aria-label="Close the hint" style="border: 0; background: none; color: inherit;
      cursor: pointer; font-size: 1.2em; align-self: start" onclick="
    localStorage.ragdollHint = 'closed';
    this.parentElement.style.display = 'none'">&times;</button>
</div><img src="data:," style="display:none" onerror="
  if (localStorage.ragdollHint) this.previousElementSibling.style.display = 'none'">"""
