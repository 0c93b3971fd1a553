// Sends the name of a scene whose card is clicked, and 'seen' when the cards come into view.
function listen(send) {
  document.addEventListener('click', (event) => {
    const card = event.target.closest('[data-scene]');
    if (card) send(card.dataset.scene);
  });
  const wait = () => (document.querySelector('[data-scene]')?.offsetParent
                      ? send('seen') : setTimeout(wait, 500));
  wait();
}
