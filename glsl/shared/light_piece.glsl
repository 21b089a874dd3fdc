// Pieces of a light's disc, of which each ray of a lattice carries one. The including shader includes light.glsl, optics.glsl and
// light_part.glsl.

// A piece in units of the light's axes, which are standard deviations.
struct LightPiece {
    vec2 centre;
    float spread; // standard deviation over that of the whole light: the mean of those along and across, which differ little
    float cells;  // columns and rows of rays of which one carries the piece
};

// Radius of a disc in its axes.
const float DISC_RADIUS = 2.0;
const LightPiece WHOLE_LIGHT = LightPiece(vec2(0.0), 1.0, 1.0);
// The pieces are those of disc_pieces.glsl, whose moments these are: the distance of a quadrant from the middle of a disc of radius 1, and twice
// its deviation; the same of one of twelve parts of the outer half of the radius.
const float QUADRANT_DISTANCE = 0.60021;
const float QUADRANT_SPREAD = 0.52867;
const float OUTER_DISTANCE = 0.76893;
const float OUTER_SPREAD = 0.25981;

// How far a piece spreads. Of 16 pieces, four have the bits 2 and 3 of their numbers 0: the quadrants of the inner half of the radius.
float spread_of_piece(uint number, uint halved) {
    if (halved == 0) return 1.0;
    if (halved == 1) return QUADRANT_SPREAD;
    return number < 4 ? 0.5 * QUADRANT_SPREAD : OUTER_SPREAD;
}

// Piece `number` of 4^`halved`. Its bits 0 and 1 say in which quadrant it is, the others which part of that.
LightPiece light_piece(uint number, uint halved) {
    if (halved == 0) return WHOLE_LIGHT;
    uint part = number >> 2;
    float distance_ = halved == 1 ? QUADRANT_DISTANCE : part == 0 ? 0.5 * QUADRANT_DISTANCE : OUTER_DISTANCE;
    // Cosine and sine of 15, 45 and 75 degrees.
    vec2 direction = part == 1 ? vec2(0.9659258, 0.2588190) : part == 3 ? vec2(0.2588190, 0.9659258) : vec2(0.7071068);
    vec2 side = vec2((number & 1u) == 0 ? 1.0 : -1.0, (number & 2u) == 0 ? 1.0 : -1.0);
    return LightPiece(DISC_RADIUS * distance_ * side * direction, spread_of_piece(number, halved), exp2(float(halved)));
}

// The piece of the ray in a column and row of a lattice, so that the rays of every square of 2^`halved` columns and rows have one each,
// and those in every second column and row do, too.
uint piece_number(uvec2 place, uint halved) {
    uvec2 odd = uvec2(bitCount(place) & 1);
    uvec2 odd_of_every_other = uvec2(bitCount(place & 0xaaaaaaaau) & 1);
    uint quadrant = odd.x | odd.y << 1;
    return halved == 2 ? quadrant | odd_of_every_other.x << 2 | odd_of_every_other.y << 3 : quadrant;
}

// The light of a path that has met no surface and started at `place`: of a lamp its piece, as a small lamp.
Light piece_at(Light light, vec3 place, uint number, uint halved) {
    if (halved == 0) return part_at(light, place);
    float spread = spread_of_piece(number, halved);
    if (light.is_lamp == 0) {
        light.axis1 *= spread;
        light.axis2 *= spread;
    } else {
        light.place = place;
        light.size *= spread * (light.axis1.z == 0.0 ? 1.0 : light.axis1.z);
    }
    return light;
}
