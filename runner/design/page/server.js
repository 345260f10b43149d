// Messages to the program that serves this page. The token is the address's fragment, which browsers do not send
// to servers; it stays there, so that the page can be loaded again.

const token = location.hash.slice(1);
let gone = false;
const listeners = [];

/** Calls back when the program has gone, and when it answers again. */
export function on_connection(listener) {
  listeners.push(listener);
}

function tell(is_gone) {
  if (gone === is_gone) return;
  gone = is_gone;
  listeners.forEach(listener => listener(!is_gone));
}

/** What the server refused; `found` is the file as another program left it. */
export class Refused extends Error {
  constructor({error, found}) {
    super(error);
    this.found = found;
  }
}

/** Sends a message. \throws Refused; Error if there is no server */
export async function ask(message, values = {}) {
  let response;
  try {
    response = await fetch(`/${message}`, {
      method: 'POST', headers: {'X-Palpate-Token': token, 'Content-Type': 'application/json'}, body: JSON.stringify(values),
    });
  } catch {
    tell(true);
    throw new Error('palpate design has ended.');
  }
  tell(false);
  if (response.status === 403) throw new Error('This address has no valid token: open the one that palpate design prints.');
  if (response.status === 413) throw new Error('The text is above 16 MiB.');
  if (!response.ok && response.status !== 409) throw new Error((await response.text()).trim());
  const answer = await response.json();
  if (response.status === 409) throw new Refused(answer);
  return answer;
}
