// Lets a comma be typed for the decimal point in number fields, which else drop it: 0,5 became 5.
if (!window.ragdollDecimalComma) {
  window.ragdollDecimalComma = true;
  document.addEventListener('beforeinput', (event) => {
    if (!event.data?.includes(',') || !event.target.matches('input[inputmode=decimal]')) return;
    event.preventDefault();
    document.execCommand('insertText', false, event.data.replace(',', '.'));
  }, true);
}
