// SPDX-License-Identifier: MIT
// A button that acts when it is held for HELD_MS, so that a glove that brushes it does not; by a key it acts at once.

const HELD_MS = 1000;

// `act()` once it was held; `brushed()` when it was let go before.
export function onHeld(button, act, brushed) {
  let timer = null, begun = 0;
  const end = () => {
    clearTimeout(timer);
    timer = null;
    button.classList.remove('held');
  };
  button.onpointerdown = ({ pointerId, timeStamp }) => {
    button.setPointerCapture(pointerId);
    button.classList.add('held');
    begun = timeStamp;
    timer = setTimeout(() => { end(); act(); }, HELD_MS);
  };
  button.onpointerup = ({ timeStamp }) => { if (timer !== null) (timeStamp - begun < HELD_MS ? brushed : act)(); end(); };  // a busy page's timer is late
  button.onpointercancel = end;
  button.oncontextmenu = (e) => e.preventDefault();
  button.onclick = ({ detail }) => { if (!detail) act(); };
}
