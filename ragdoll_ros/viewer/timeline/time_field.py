"""The field of the time: a page tells when one begins to type there, and when that is over."""
from __future__ import annotations

HOLD = 'hold'
"""How what is told ends while one types."""

TELL = """<img src="data:," style="display:none" onerror="
  const isFirst = !window.ragdollTime;
  window.ragdollTime = {slider: 'SLIDER', told: 'TOLD'};
  if (isFirst) {
    let count = 0;
    const tell = (what) => (event) => {
      const {slider, told} = window.ragdollTime;
      const row = document.getElementById(slider)?.parentElement;
      if (row?.contains(event.target) && event.target.matches('input:not([type=hidden])'))
        window.__viserMutable.sendMessage({
          type: 'GuiUpdateMessage', uuid: told, updates: {value: `${count++} ${what}`}});
    };
    document.addEventListener('focusin', tell('HOLD'));
    document.addEventListener('focusout', tell('free'));
  }">"""
"""Tells it in the value of a field that nobody sees, counted, as what is the same is not told."""


def tell(slider: str, told: str) -> str:
    """HTML for a page, by the ids of the slider that has the field, and of the field to tell in."""
    return TELL.replace('SLIDER', slider).replace('TOLD', told).replace('HOLD', HOLD)
