"""A page tells of its own uploads alone.

Viser tells each page of all of them, those of before it was opened too, without their names.
"""
from __future__ import annotations

OWN_UPLOADS = """<img src="data:," style="display:none" onerror="
  if (!window.ragdollUploads) {
    const hide = () => document.querySelectorAll('.mantine-Notification-root').forEach((note) => {
      if (note.textContent.startsWith('Uploading undefined')) note.style.display = 'none';
    });
    window.ragdollUploads = new MutationObserver(hide);
    window.ragdollUploads.observe(document.body, {childList: true, subtree: true});
  }">"""
"""For the panel. An observer is called before what has come is drawn."""
