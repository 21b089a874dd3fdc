// How finely images are divided, and the error that this leaves. Errors are relative to the flux of a receiver.
//
// `share` is the patch's part of that flux and `patch_share` the part that patches aim for; lengths are in texels.

// Parts of a facet with this flux, along an edge.
float facet_division(float share, float patch_share) {
    return rounded(sqrt(share / patch_share), MAX_PATCH_DIVISION);
}

// Deviation of one of `parts`^2 patches of a facet; see image_division(). If the facet is merged, of triangles with `along` on an edge, no
// smaller patch bends: light is linear on each triangle.
float deviation_of_part(float deviation, float parts, uint along) {
    return along > 0 && parts >= float(along) ? 0.0 : deviation / (parts * parts);
}

// Triangles of a patch along an edge, so that their errors are alike. `deviation` is the largest distance of the image of
// a side's midpoint from the middle of the side's image.
float image_division(float share, float deviation, float height, float blur, float patch_share) {
    return rounded(sqrt(sqrt(32.0 * share * deviation / (clamp(height, blur, 4.0 * blur) * patch_share))), MAX_IMAGE_DIVISION);
}

// The same where light is blocked in a part of the patch. `exposed` is the share of its facet's outline at which the surface ends or bends.
// Shadows are as smooth as the blur, where the division reaches it.
float mixed_division(float share, float longest, float blur, float exposed, float patch_share) {
    const float most = 7.0;
    float smooth_ = clamp(ceil(longest / blur), 2.0, most);
    return clamp(ceil(sqrt(4.0 * share * max(min(longest / blur, 1.0), exposed) / patch_share)), smooth_, most);
}

// Light that is at the wrong place because `n`^2 triangles with straight sides stand for the image.
float image_error(float share, float deviation, float longest, float blur, float n) {
    return share * min(deviation / (n * n * max(longest / n, blur)), 1.0);
}

// Light at the wrong place because each of n^2 triangles is lit or not as a whole. Neighbours make up for what an image has too much or
// too little, but not where the surface ends or bends.
float shadow_error(float share, float longest, float blur, float exposed, float n) {
    return share / (2.0 * n) * max(min(longest / (n * blur), 1.0), exposed * inversesqrt(n));
}

// Share of a facet's light that is at the wrong place because the profile is that of a parallelogram in place of the light's disc.
// Without a disc the blur is 1. The images of neighbours continue a facet's image and hide the profile.
float profile_error(float blur) {
    return 0.01 * max(1.0 - 1.0 / (blur * blur), 0.0);
}

// The part of the estimated error that does not depend on the number of patches.
float fixed_error(float of_profiles) {
    return of_profiles + 0.001;
}

// The relative L1 error from the sums of these errors over a receiver. The factors are fitted to the true errors of six
// third-party and five generated meshes at 1 to 8 %, within a factor of two. Where patches are coarse, some errors go unseen.
float estimated_error(vec3 errors) {
    float divided = errors.x + 0.6 * errors.y;
    return divided * (1.0 + 10.0 * divided) + fixed_error(errors.z);
}
