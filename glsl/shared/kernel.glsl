// The kernel that spreads the flux of a patch. Covariances are stored as (xx, xy, yy).

// Four points stand for a narrow disc, at this distance in both directions of the columns of the covariance's symmetric root.
const float DISC_POINTS = 4.0;
const float POINT_DISTANCE = sqrt(2.0);

vec3 outer2(vec2 v) {
    return vec3(v.x * v.x, v.x * v.y, v.y * v.y);
}

float cross2(vec2 a, vec2 b) {
    return a.x * b.y - a.y * b.x;
}

// R R^T of a root R.
vec3 covariance_of(mat2 root) {
    return outer2(root[0]) + outer2(root[1]);
}

// The determinant of R R^T plus `isotropic` on each axis, as a sum: the usual formula cancels to nothing, or below it, where an image is
// thousands of times as long as it is wide, as that of a grazing disc.
float determinant_of(mat2 root, float isotropic) {
    float area = cross2(root[0], root[1]);
    return area * area + isotropic * (dot(root[0], root[0]) + dot(root[1], root[1]) + isotropic);
}

// The symmetric root of a covariance with this determinant (Levinger 1980).
mat2 symmetric_root(vec3 m, float determinant) {
    float root = sqrt(max(determinant, 0.0));
    m = (m + root * vec3(1.0, 0.0, 1.0)) * inversesqrt(max(m.x + m.z + 2.0 * root, 1e-12));
    return mat2(m.xy, m.yz);
}

// Sides of a parallelogram with the covariance m. It tends to the texel itself where the disc is small. Its area is box_area().
mat2 blur_box(vec3 m, float determinant) {
    return sqrt(12.0) * symmetric_root(m, determinant);
}

float box_area(float determinant) {
    return 12.0 * sqrt(max(determinant, 0.0));
}

// d^T m d
float quadratic2(vec3 m, vec2 d) {
    return m.x * d.x * d.x + 2.0 * m.y * d.x * d.y + m.z * d.y * d.y;
}

// The smaller eigenvalue of the covariance m.
float minor_eigenvalue(vec3 m, float determinant) {
    float middle = 0.5 * (m.x + m.z);
    return determinant / (middle + sqrt(max(middle * middle - determinant, 0.0)));
}

// The kernel ((1 - t) / (1 - beta t))^4 at t = d^T conic d, with the flatness beta: 0 gives a bell, values toward 1
// nearly a disc. Its integral over the plane is pi mean / sqrt(det conic).
float kernel_value(float flatness, float t) {
    float root = max(1.0 - t, 0.0) / (1.0 - flatness * min(t, 1.0));
    float square = root * root;
    return square * square;
}
