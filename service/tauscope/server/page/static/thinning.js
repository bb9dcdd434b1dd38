// Many samples thinned to the screen's columns: what a column shows of each curve is where it enters, its extremes, and where it leaves.

/** First index whose value is not below `value`, of an increasing column. */
export function lowerBound(column, value) {
  let low = 0;
  let high = column.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (column[middle] < value) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** A column at another instant, on the straight line between its neighbours, or that of its first or last two. */
export function interpolate(x, column, at) {
  const right = Math.min(Math.max(lowerBound(x, at), 1), x.length - 1);
  const share = (at - x[right - 1]) / (x[right] - x[right - 1] || 1);
  return column[right - 1] + share * (column[right] - column[right - 1]);
}

export function nearest(time, value) {
  const right = Math.min(lowerBound(time, value), time.length - 1);
  return right > 0 && value - time[right - 1] < time[right] - value ? right - 1 : right;
}

/**
 * Four points of every column in each of `buckets` stretches between two instants: the first, the extremes in the order
 * in which they come, the last. All columns share the instants; an extreme is at most one stretch from its own.
 */
export function thinned(time, columns, from, to, buckets) {
  const first = Math.max(lowerBound(time, from) - 1, 0);
  const last = Math.min(lowerBound(time, to) + 1, time.length);
  const count = last - first;
  if (count <= 4 * buckets) {
    return [Array.from(time.slice(first, last)), ...columns.map((column) => Array.from(column.slice(first, last), drawable))];
  }
  const x = new Array(4 * buckets);
  const out = columns.map(() => new Array(4 * buckets));
  for (let bucket = 0; bucket < buckets; bucket += 1) {
    const start = first + Math.floor((bucket * count) / buckets);
    const stop = first + Math.floor(((bucket + 1) * count) / buckets) - 1;
    const step = (time[stop] - time[start]) / 3;
    for (let part = 0; part < 4; part += 1) x[4 * bucket + part] = time[start] + part * step;
    columns.forEach((column, place) => {
      let low = -1;
      let high = -1;
      for (let row = start; row <= stop; row += 1) {
        const value = column[row];
        if (!Number.isFinite(value)) continue;
        if (low < 0 || value < column[low]) low = row;
        if (high < 0 || value > column[high]) high = row;
      }
      const turns = low < 0 ? [] : [...new Set([Math.min(low, high), Math.max(low, high)])].filter((row) => row > start && row < stop);
      const [one, two] = inner(column[start], column[stop], turns.map((row) => column[row]), turns[0] - start < stop - turns[0]);
      out[place][4 * bucket] = drawable(column[start]);
      out[place][4 * bucket + 1] = drawable(one);
      out[place][4 * bucket + 2] = drawable(two);
      out[place][4 * bucket + 3] = drawable(column[stop]);
    });
  }
  return [x, ...out];
}

/** The two points between the first and the last of a stretch: its extremes, or on straight lines where those are its ends. */
function inner(first, last, turns, isEarly) {
  if (turns.length === 2) return turns;
  if (!turns.length) return [between(first, last, 1 / 3), between(first, last, 2 / 3)];
  return isEarly ? [turns[0], between(turns[0], last, 1 / 2)] : [between(first, turns[0], 1 / 2), turns[0]];
}

function between(one, other, share) {
  if (!Number.isFinite(one)) return other;
  return Number.isFinite(other) ? one + share * (other - one) : one;
}

const drawable = (value) => (Number.isFinite(value) ? value : null);
