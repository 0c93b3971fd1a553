// Keeps the tree before this image, which is replaced as a whole, where it was scrolled to, or moves
// it as little as shows the bone that was selected last. It may have been replaced since.
const tree = this.previousElementSibling, row = tree?.querySelector('[data-last]');
if (tree) tree.scrollTop = window.ragdollTreeScroll ?? 0;
if (row) tree.scrollTop = Math.min(row.offsetTop, Math.max(
  tree.scrollTop, row.offsetTop + row.offsetHeight - tree.clientHeight));
if (tree) tree.onscroll = () => { window.ragdollTreeScroll = tree.scrollTop; };
