// Sends which row of the tree is clicked: 'one <bone>', or 'more <bone>' with Ctrl, Cmd or Shift.
function listen(send) {
  document.addEventListener('click', (event) => {
    const bone = event.target.closest?.('.ragdoll-tree [data-bone]')?.dataset.bone;
    const more = event.ctrlKey || event.metaKey || event.shiftKey;
    if (bone !== undefined) send(`${more ? 'more' : 'one'} ${bone}`);
  });
}
