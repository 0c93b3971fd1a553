// Lowers what is drawn while that takes a page below 20 pictures a second, and says so: first the
// shadows go, then resolution. Another size of the window begins anew. Viser itself lowers the
// resolution by a quarter at most. Pages whose pictures are compared set ragdollKeepsQuality.
const LEVELS = [[true, 1, ''], [false, 1, 'without shadows'],
                [false, 0.6, 'without shadows, at 60 % of the resolution'],
                [false, 0.4, 'without shadows, at 40 % of the resolution']];
const SLOW = 20, PERIOD = 2000;
// Few pictures are a lack of speed only where each chance to draw was used: a page at rest draws one
// a second, a busy script leaves chances out.
window.ragdollIsSlow ??= (chances, pictures, seconds) =>
  chances < SLOW * seconds && pictures > chances / 2;
if (!window.ragdollQuality) {
  const state = window.ragdollQuality = {level: 0};
  let since = performance.now(), chances = 0, before = 0, size = '';
  const say = (canvas, text, rate) => {
    const place = canvas.parentElement.parentElement;
    let note = place.querySelector('.ragdoll-quality');
    if (!note) {
      note = document.createElement('div');
      note.className = 'ragdoll-quality';
      note.setAttribute('role', 'status');
      place.append(note);
    }
    note.textContent = text && `Drawn ${text}: this browser made ${rate} pictures a second`;
    note.style.display = text ? '' : 'none';
  };
  const apply = (viewer, root) => {
    const [shadows, resolution] = LEVELS[state.level];
    for (const light of viewer.scene.children) if (light.shadow) light.castShadow = shadows;
    const dpr = devicePixelRatio * resolution;
    if (state.level > 1 && root.viewport.dpr > dpr) root.setDpr(dpr);
  };
  const look = (now) => {
    requestAnimationFrame(look);
    const viewer = window.__viserMutable, root = viewer?.scene?.__r3f?.root?.getState();
    chances += 1;
    if (!root || now - since < PERIOD) return;
    const pictures = root.gl.info.render.frame - before, seconds = (now - since) / 1000;
    const isSlow = window.ragdollIsSlow(chances, pictures, seconds);
    const is = `${viewer.canvas.clientWidth} ${viewer.canvas.clientHeight}`;
    [since, chances, before] = [now, 0, root.gl.info.render.frame];
    if (window.ragdollKeepsQuality || document.hidden) return;
    if (is !== size) {
      size = is;
      if (state.level > 1) root.setDpr(devicePixelRatio);
      if (state.level) say(viewer.canvas, LEVELS[state.level = 0][2], 0);
    } else if (isSlow && state.level < LEVELS.length - 1) {
      state.level += 1;
      say(viewer.canvas, LEVELS[state.level][2], Math.round(pictures / seconds));
    }
    apply(viewer, root);
  };
  requestAnimationFrame(look);
}
