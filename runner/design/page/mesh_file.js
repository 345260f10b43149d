// Mesh files that are dropped or chosen: copied beside the protocol, and added as a stimulus.

import {add_item} from './decisions.js';
import {ask} from './server.js';
import {element} from './dom.js';
import {free_name} from './references.js';
import {name_of_file} from './start_view.js';

const kPart = 8 << 20;  // bytes; in base64 with its message below 16 MiB
const kAccepted = '.obj,.stl,.gltf,.glb,.ply,.off,.3mf,.msh';

async function base64_of(part) {
  const bytes = new Uint8Array(await part.arrayBuffer());
  let text = '';
  for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
  return btoa(text);
}

/** Sends a file, a long one in parts. `told`: the share that is sent. Returns the answer to "mesh". */
async function send(file, told) {
  if (file.size <= kPart) return ask('mesh', {name: file.name, bytes: await base64_of(file)});
  const {upload} = await ask('upload');
  for (let at = 0; at < file.size; at += kPart) {
    told(at / file.size);
    await ask('part', {upload, bytes: await base64_of(file.slice(at, at + kPart))});
  }
  told(1);
  return ask('mesh', {name: file.name, upload});
}

/** A place to drop a file, with a button that chooses one; it adds a stimulus to the form. */
export function mesh_place(form, added) {
  const words = element('span', {class: 'soft', role: 'status'});
  async function take(file) {
    if (!file) return;
    words.textContent = `${file.name} is read.`;
    try {
      const mesh = await send(file, share => words.textContent = share < 1 ? `${file.name}: ${Math.round(100 * share)} % is sent.` : `${file.name} is read.`);
      if (!form.read()) throw new Error(`The text is not JSON: ${mesh.file} is beside the protocol, but no stimulus was added.`);
      const entries = Array.isArray(form.values.stimuli) ? form.values.stimuli : [];
      const name = free_name(entries.map(one => one?.name), name_of_file(mesh.file.replace(/\.\w+$/, '')));
      const value = {name, shape: 'mesh', file: mesh.file, ...(mesh.scale === 1 ? {} : {scale: mesh.scale}), ...(mesh.soft ? {soft: mesh.soft} : {})};
      added(entries.length);
      form.rebuild(add_item(form.document.text, [], 'stimuli', value), ['stimuli', entries.length, 'name']);
      const why = mesh.scale === 1 ? '' : ` Scale ${mesh.scale} is proposed from its size.`;
      words.textContent = `${mesh.notes.join('; ')}.${why}`;
    } catch (error) {
      words.textContent = error.message;
    }
  }
  const chooser = element('input', {type: 'file', accept: kAccepted, hidden: true, 'aria-label': 'Mesh file', onchange: () => take(chooser.files[0]).then(() => chooser.value = '')});
  const place = element('div', {class: 'drop', ondragover: event => {
    event.preventDefault();
    place.classList.add('over');
  }, ondragleave: () => place.classList.remove('over'), ondrop: event => {
    event.preventDefault();
    place.classList.remove('over');
    take(event.dataTransfer.files[0]);
  }}, element('button', {type: 'button', text: 'Add a mesh file', 'data-pointer': '/stimuli#mesh', onclick: () => chooser.click()}), chooser,
  element('span', {class: 'soft', text: 'or drop one here: it is copied beside the protocol.'}), words);
  return {place, take};
}
