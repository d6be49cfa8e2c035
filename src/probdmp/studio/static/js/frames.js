// The binary message of every display tick: studio's only hot path.

const KINDS = { 1: "playing", 2: "tracing" };
const HEADER = 24;

/** From little-endian bytes to {kind, failed, stale, sequence, time, phase, logLikelihood, testRatio, measured, …}. */
export function decodeFrame(buffer) {
  const view = new DataView(buffer);
  const size = view.getUint16(2, true);
  const array = (k) => Array.from({ length: size }, (_, d) => view.getFloat32(HEADER + 4 * (k * size + d), true));
  return {
    kind: KINDS[view.getUint8(0)],
    failed: (view.getUint8(1) & 1) !== 0,
    stale: (view.getUint8(1) & 2) !== 0,
    sequence: view.getUint32(4, true),
    time: view.getFloat32(8, true),
    phase: view.getFloat32(12, true),
    logLikelihood: view.getFloat32(16, true),
    testRatio: view.getFloat32(20, true),
    measured: array(0),
    desired: array(1),
    upper: array(2),
    contributions: array(3),
  };
}
