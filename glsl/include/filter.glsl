// What a filter reads and writes, by variant. T is the type of one texel.
//   slice     layers to layers, or to slices of the 3D texture; an invocation's z is its slice within the batch
//   distance  2D to 2D, one channel with misses
//   picture   2D to 2D, colours, channel by channel
// SOURCE_3D declares the source three-dimensional: layers, or the part of the volume that is stored.
#include "common.glsl"

#ifdef PICTURE
#define T vec4
#define STORED(v) (v)
#define LOADED(v) (v)
#else
#define T float
#define STORED(v) vec4(v, 0.0, 0.0, 0.0)
#define LOADED(v) ((v).x)
#endif

#ifdef DISTANCE
#define VALID(v) is_hit(v)
#else
#define VALID(v) true
#endif

#ifdef SOURCE_3D
uniform texture3D source;
ivec3 source_size() { return textureSize(source, 0); }
T read_at(ivec3 at) { return LOADED(texelFetch(source, at, 0)); }
#else
#if defined(DISTANCE) || defined(PICTURE)
uniform texture2D source;
ivec3 source_size() { return ivec3(textureSize(source, 0), 1); }
T read_at(ivec3 at) { return LOADED(texelFetch(source, at.xy, 0)); }
#else
uniform texture2DArray source;
ivec3 source_size() { return textureSize(source, 0); }
T read_at(ivec3 at) { return LOADED(texelFetch(source, ivec3(at.xy, gl_GlobalInvocationID.z), 0)); }
#endif
#endif

#if defined(DISTANCE) || defined(PICTURE)
uniform writeonly image2D target;
ivec2 place_in_target(ivec3 at) { return at.xy; }
#else
#include "volume_target.glsl"
#endif

// The first of the `run` texels along an axis that this invocation makes, relative to the visible rectangle of a slice.
ivec3 made_run(int axis, int run) {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    at[axis] *= run;
#if !defined(DISTANCE) && !defined(PICTURE)
    at.xy += ivec2(first_column, first_row);
#endif
    return at;
}
ivec3 made_texel() { return made_run(0, 1); }

void write_at(ivec3 at, T value) { imageStore(target, place_in_target(at), STORED(value)); }
