// The floor, seen from straight above and without the ring, reflects the caustic and a constant by Lambert's law.

@group(0) @binding(0) var light_map: texture_2d<f32>; // W/m^2
@group(0) @binding(1) var linear: sampler;

// The floor's tile of the light map, in texels.
override left: f32;
override top: f32;
override width: f32;
override height: f32;

const ALBEDO = vec3f(0.62, 0.47, 0.33);
const CONSTANT = 0.2; // W/m^2, in place of the direct light, which the program does not request
const WHITE = 0.5; // W/m^2/sr
const PI = 3.14159265;

struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) texel: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Vertex {
    // One triangle that covers the picture: its corners are at 0 and 2.
    let corner = vec2f(f32(index & 1u), f32(index >> 1u)) * 2.0;
    let position = vec4f(corner.x * 2.0 - 1.0, 1.0 - corner.y * 2.0, 0.0, 1.0);
    return Vertex(position, vec2f(left, top) + corner * vec2f(width, height));
}

@fragment
fn fragment(in: Vertex) -> @location(0) vec4f {
    // At least half a texel inside the tile, so that the sampler does not blend in another tile.
    let low = vec2f(left, top) + 0.5;
    let high = vec2f(left + width, top + height) - 0.5;
    let uv = clamp(in.texel, low, high) / vec2f(textureDimensions(light_map));
    let irradiance = textureSample(light_map, linear, uv).rgb + CONSTANT;
    let radiance = irradiance * ALBEDO / PI;
    return vec4f(radiance / (radiance + WHITE), 1.0); // the target is sRGB
}
