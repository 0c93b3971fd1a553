// Hides the notices of uploads by other pages, or before this one was opened: viser shows all of
// them everywhere, without names. A MutationObserver is called before they are drawn.
if (!window.ragdollUploads) {
  const hide = () => document.querySelectorAll('.mantine-Notification-root').forEach((notice) => {
    if (notice.textContent.startsWith('Uploading undefined')) notice.style.display = 'none';
  });
  window.ragdollUploads = new MutationObserver(hide);
  window.ragdollUploads.observe(document.body, {childList: true, subtree: true});
}
