// The units of a protocol's numbers. A key says its unit (radius_m); people read lengths in mm.

// The longest first: stiffness_n_per_m is no length.
const kUnits = [
  ['_per_m_per_s', 's/m'], ['_n_per_m', 'N/m'], ['_ns_per_m', 'N s/m'], ['_m_per_s2', 'm/s²'], ['_m_per_s', 'm/s'], ['_kg_per_m3', 'kg/m³'],
  ['_rad_per_s', 'rad/s'], ['_per_s', '1/s'], ['_m', 'mm', 3], ['_n', 'N'], ['_s', 's'], ['_hz', 'Hz'], ['_deg', '°'],
  ['_db', 'dB'], ['_kg', 'kg'], ['_pa', 'Pa'], ['_bits', 'bit'], ['_minutes', 'min'], ['_seconds', 's'],
];
const kNone = {unit: '', shift: 0};

/** The unit that people read, and by how many digits the number is moved for them. */
export function unit_of(key) {
  const found = kUnits.find(([end]) => key.endsWith(end));
  return found ? {unit: found[1], shift: found[2] ?? 0} : kNone;
}

/** "radius_m" as a label: "radius". */
export function label_of(key) {
  const found = kUnits.find(([end]) => key.endsWith(end));
  const name = found ? key.slice(0, -found[0].length) : key;
  return (name || key).replaceAll('_', ' ');
}

/** Moves the decimal point of a written number to the right; no digit is calculated. Null: it is no plain number. */
export function shifted(written, by) {
  const parts = /^(-?)(\d*)(?:\.(\d*))?(?:[eE]([+-]?\d+))?$/.exec(written.trim());
  if (!parts || (parts[2] === '' && !parts[3])) return null;
  const [, sign, whole, fraction = '', exponent = '0'] = parts;
  const point = whole.length + Number(exponent) + by;
  if (Math.abs(point) > 400) return null;
  let digits = whole + fraction;
  let at = point;
  if (at <= 0) {
    digits = '0'.repeat(1 - at) + digits;
    at = 1;
  }
  digits = digits.padEnd(at, '0');
  const left = digits.slice(0, at).replace(/^0+(?=\d)/, ''), right = digits.slice(at).replace(/0+$/, '');
  return sign + left + (right ? `.${right}` : '');
}

/** A number of the file as people read it: "0.0255" of "radius_m" is "25.5". */
export function shown_number(key, written) {
  const {shift} = unit_of(key);
  return shift === 0 ? written : shifted(written, shift) ?? written;
}
/** And back; null: it is no number. */
export function written_number(key, shown) {
  const {shift} = unit_of(key);
  const plain = shifted(shown.replace(',', '.').replace('\u2212', '-'), -shift);
  if (plain === null) return null;
  return shift === 0 ? shown.trim().replace(',', '.').replace('\u2212', '-').replace(/^(-?)0+(?=\d)/, '$1').replace(/^(-?)\./, '$10.').replace(/\.$/, '') : plain;
}

/** A value in words: "25 mm", "0.1, 0, 0 m/s". */
export function value_in_words(key, value) {
  const {unit, shift} = unit_of(key);
  const one = number => String(+(number * 10 ** shift).toPrecision(6));
  const numbers = list => list.map(item => (Array.isArray(item) ? `(${numbers(item)})` : typeof item === 'number' ? one(item) : item)).join(', ');
  const text = typeof value === 'number' ? one(value) : Array.isArray(value) ? numbers(value) : String(value);
  return unit ? `${text} ${unit}` : text;
}

/** A description for people: without the unit that stands beside the field, its lengths in mm. */
export function hint_in_words(key, words) {
  const {unit, shift} = unit_of(key);
  if (!unit) return words;
  const own = shift === 0 ? unit : 'm';
  let text = words === own || words.startsWith(`${own};`) || words.startsWith(`${own},`) || words.startsWith(`${own}.`) ? words.slice(own.length + 1).trim() : words;
  if (shift !== 0) {
    const moved = (all, before, number) => `${before}${shifted(number, shift) ?? number} mm`;
    text = text.replace(/(default )(\d+(?:\.\d+)?)(?! *mm)/g, moved).replace(/((?:^|[ (]))(\d+(?:\.\d+)?) m\b/g, moved);
  }
  return text.charAt(0).toUpperCase() + text.slice(1);
}
