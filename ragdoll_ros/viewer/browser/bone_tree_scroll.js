// Keeps the tree before this image, which is replaced as a whole, where it was scrolled to, or moves
// it as little as shows the bone that was selected last.
const tree = this.previousElementSibling, row = tree.querySelector('[data-last]');
tree.scrollTop = window.ragdollTreeScroll ?? 0;
if (row) tree.scrollTop = Math.min(row.offsetTop, Math.max(
  tree.scrollTop, row.offsetTop + row.offsetHeight - tree.clientHeight));
tree.onscroll = () => { window.ragdollTreeScroll = tree.scrollTop; };
