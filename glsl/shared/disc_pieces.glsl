// Pieces of a light's disc, each with the same light: outline_error.glsl says what for.

// The inner half of the radius has the first quarter of the pieces, sectors of a disc, and the outer half the others, sectors of a ring.
// Four pieces are the quadrants.
struct Piece {
    vec2 centre;     // in units of the radius
    mat2 root;       // of the covariance around the centre
};

Piece piece_of(uint index, uint pieces) {
    bool has_ring = pieces > 4;
    bool outer = has_ring && index >= pieces / 4;
    float sectors = float(!has_ring ? pieces : outer ? pieces - pieces / 4 : pieces / 4);
    float within = outer ? 0.5 : 0.0;
    float beyond = has_ring && !outer ? 0.5 : 1.0;
    float width = 2.0 * PI / sectors;
    float angle = (float(outer ? index - pieces / 4 : index) + 0.5) * width;
    // Moments of a sector of a ring.
    float square = 0.5 * (within * within + beyond * beyond);
    float distance_ = 2.0 / 3.0 * (beyond * beyond * beyond - within * within * within) / (beyond * beyond - within * within) * sin(0.5 * width) / (0.5 * width);
    float along = 0.5 * square * (1.0 + sin(width) / width) - distance_ * distance_;
    float across = 0.5 * square * (1.0 - sin(width) / width);
    vec2 axis = vec2(cos(angle), sin(angle));
    return Piece(distance_ * axis, mat2(sqrt(along) * axis, sqrt(across) * vec2(-axis.y, axis.x)));
}
