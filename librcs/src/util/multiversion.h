#pragma once

/// Put before a hot loop's function: compiled for several instruction sets, the best one chosen when the
/// program starts. All give the same bits, since contraction is off and no sum crosses lanes.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(RCS_SANITIZE)
#define RCS_MULTIVERSION __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define RCS_MULTIVERSION
#endif

#define RCS_ALWAYS_INLINE inline __attribute__((always_inline))

/// Put before a loop whose steps have nothing to do with each other, whatever its arrays may overlap with: of many of
/// them gcc does not ask. (clang asks of more, and warns where sanitizers keep it from obeying.)
#if defined(__GNUC__) && !defined(__clang__)
#define RCS_INDEPENDENT_LOOP _Pragma("GCC ivdep")
#else
#define RCS_INDEPENDENT_LOOP
#endif

/// Put before a short inner loop with a known count that shall become vectors: gcc 12 first takes such a loop apart
/// into single steps, and then finds no more than pairs among them (a glossy splat took four times as long).
#if defined(__GNUC__) && !defined(__clang__)
#define RCS_WHOLE_LOOP _Pragma("GCC unroll 1")
#else
#define RCS_WHOLE_LOOP
#endif
