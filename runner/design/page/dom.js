// Elements of the page.

/** An element. Attributes that begin with "on" are listeners, `text` is its text. Children that are null are left out. */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (key === 'text') made.textContent = value;
    else if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
    else made.setAttribute(key, value === true ? '' : value);
  }
  made.append(...children.flat().filter(child => child !== null && child !== undefined));
  return made;
}

export const by_id = id => document.getElementById(id);

/** "1 fault", "3 faults" */
export const counted = (n, word) => `${n} ${word}${n === 1 ? '' : 's'}`;

/** Seconds in words: "40 s", "25 min", "1.8 h". */
export function spoken_time(seconds) {
  if (seconds < 60) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}
