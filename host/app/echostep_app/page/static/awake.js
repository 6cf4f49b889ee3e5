// SPDX-License-Identifier: MIT
// Keeps the screen of a live page on, where the browser can: on this computer or behind https [Screen Wake Lock API].

export function stayAwake() {
  const lock = () => { if (!document.hidden) navigator.wakeLock?.request('screen').catch(() => {}); };  // refused at low battery: the screen goes dark as usual
  document.addEventListener('visibilitychange', lock);  // the lock ends when the page is hidden
  lock();
}
