// Images of facets at whose outline the surface ends or bends. Such an image has no neighbours that hide its profile: a parallelogram or a
// kernel in place of the disc and a texel is another one, and a parallelogram covers the texels unevenly where its side is no whole number
// of them. For each of several pieces of the disc, it is little wider than a texel.

// Relative error of small images by the profile, and by uneven cover of the texels with a parallelogram.
const float PROFILE_ERROR = 0.1;
const float UNEVEN_ERROR = 1.3;
// Part of the error to aim for that outlines may take.
const float OUTLINE_SHARE = 0.8;
// Numbers of pieces to choose from.
const uint PIECE_LEVELS = 3;
const uint PIECES[PIECE_LEVELS] = uint[](1, 4, MAX_PIECES);

// Share of the light at the wrong place with a parallelogram or kernel for each of `pieces` of the disc. `outline` is the height of the
// image and the share of its outline at which the surface ends or bends. Without a disc the blur is 1.
float outline_error(vec2 outline, float blur, uint pieces) {
    float disc = max(blur * blur - 1.0, 0.0);
    float square = 1.0 + disc / float(pieces);
    float side = sqrt(square);
    // The disc's profile is right as far as its pieces resolve it.
    float profile = PROFILE_ERROR * disc / (disc + 1.0) * min(blur / max(outline.x, 1e-3), 1.0) * inversesqrt(float(pieces));
    // Fourier transforms at the frequency of the texels: of a square, whose light goes to coarser levels where it is wide, and of the image.
    // The pieces are at different places of a texel. Thin images have their exact share of the texels.
    bool is_uneven = outline.x >= THIN_HEIGHT * side && side < 2.0;
    float uneven = is_uneven ? UNEVEN_ERROR * abs(sin(PI * side)) / (PI * side) * min(1.0 / (PI * max(outline.x, 1e-3)), 1.0) : 0.0;
    uneven *= exp(-PI * PI / 6.0 * (disc + 1.0 - square));
    return outline.y * (profile + uneven);
}

// Whether the facet's light needs pieces of the disc.
bool needs_pieces(vec2 outline, float blur, float error) {
    return outline.y > 0.0 && outline_error(outline, blur, 1) > OUTLINE_SHARE * error;
}
