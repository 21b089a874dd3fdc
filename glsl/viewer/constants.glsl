// Colours of the heat map from no difference to its scale and more, evenly spaced: sRGB, 0xRRGGBB, of matplotlib's `inferno`.
const uint HEAT_COLORS[9] = uint[](0x000004, 0x210c4a, 0x56106e, 0x89226a, 0xbb3754, 0xe35932, 0xf98c0a, 0xf9c932, 0xfcffa4);

// A workgroup of differences.comp adds up a square of so many texels a side.
const uint BLOCK_SIDE = 64;
