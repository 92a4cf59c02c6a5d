/** The half axes and the angle of a covariance's ellipse. */
export interface Ellipse {
  major: number;
  minor: number;
  /** Of the major axis from x towards y. */
  angle: number;
}

export function ellipseOf(varX: number, covXY: number, varY: number, sigmas: number): Ellipse {
  const mean = (varX + varY) / 2;
  const spread = Math.hypot((varX - varY) / 2, covXY);
  return {
    major: sigmas * Math.sqrt(Math.max(0, mean + spread)),
    minor: sigmas * Math.sqrt(Math.max(0, mean - spread)),
    angle: 0.5 * Math.atan2(2 * covXY, varX - varY),
  };
}
