//! Small geometry that several modules need.

use glam::{DMat2, DVec2};

/// Two vectors along the principal axes whose outer products add up to the symmetric matrix `m`.
pub fn covariance_root(m: DMat2) -> [DVec2; 2] {
    let (xx, xy, yy) = (m.x_axis.x, m.x_axis.y, m.y_axis.y);
    let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let apart = half.hypot(xy);
    let angle = 0.5 * xy.atan2(half);
    let axis = DVec2::from_angle(angle);
    [
        axis * (middle + apart).max(0.0).sqrt(),
        axis.perp() * (middle - apart).max(0.0).sqrt(),
    ]
}
