"""What pages tell that viser's widgets do not: keys that are down, focus, a text as typed."""
from __future__ import annotations

from collections.abc import Callable

import viser

SCRIPT = """<img src="data:," style="display:none" onerror="
  const all = window.ragdollTold ??= {};
  const isFirst = !all.NAME;
  all.NAME = {told: 'TOLD', widget: 'WIDGET'};
  if (isFirst) {
    let count = 0;
    const tell = (what) => window.__viserMutable.sendMessage({
      type: 'GuiUpdateMessage', uuid: all.NAME.told, updates: {value: `${count++} ${what}`}});
    const isTyped = (input) => input.matches('input:not([type=hidden])')
      && document.querySelector(`label[for='${all.NAME.widget}']`)
        ?.closest('.mantine-Flex-root').contains(input);
    LISTEN
  }">"""
"""A browser runs it whenever it shows the panel anew, viser with other ids after another start."""


def tell(gui: viser.GuiApi, name: str, listen: str, take: Callable[[int, str], None],
         widget: viser.GuiInputHandle | None = None) -> viser.GuiInputHandle[str]:
    """Have pages run ``listen`` once, a script without double quotes, which may call `tell(text)`.

    ``take`` gets the page's client_id and the text, in viser's thread, so in the order in which
    pages sent it and what else they send. In the script, `isTyped(input)` is whether an input is
    the one in which ``widget``, a labelled one, is typed. The text comes as the value of a field
    that nobody sees, with a count before it, as what is the same would not be told: it is returned.
    """
    told = gui.add_text(name, '', visible=False)

    @told.on_update
    async def _(event: viser.GuiEvent) -> None:
        take(event.client_id, event.target.value.partition(' ')[2])

    gui.add_html(SCRIPT.replace('NAME', name).replace('TOLD', told._impl.uuid)
                 .replace('WIDGET', widget._impl.uuid if widget is not None else '')
                 .replace('LISTEN', listen))
    return told
