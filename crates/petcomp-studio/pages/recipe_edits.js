/** Edits of a recipe, `[path, TOML or null]`, in the order in which the server makes them. */

/** An entry of a list goes: its later entries have other places from then on. */
const isRemoval = ([path, toml]) => toml === null && path.endsWith("]");

/**
 * The edits with one more. It takes the place of those of its key and of what is below that, as far as they are made
 * behind the last removal: the same path before that was another entry's. `own` is what the file says, by path: taking
 * back what it does not say is no edit.
 */
export function withEdit(edits, path, toml, own) {
  const settled = edits.findLastIndex(isRemoval) + 1;
  if (isRemoval([path, toml])) return [...edits, [path, toml]];
  const isBelow = ([other]) => other === path || other.startsWith(`${path}.`) || other.startsWith(`${path}[`);
  const kept = edits.filter((other, i) => i < settled || !isBelow(other));
  const isSaid = settled > 0 || path in own;
  return toml !== null || isSaid ? [...kept, [path, toml]] : kept;
}
