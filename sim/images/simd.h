// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Before a function whose loops are worth vectorising: compiled for several instruction sets, the
/// best is taken at run time. All give the same bits, since contraction to fused operations is off
/// in these files. Not under sanitizers, whose runtime is not up yet when the choice is made, nor
/// where the toolchain lacks it.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TOFTWIN_SIMD __attribute__((target_clones("default", "avx2", "avx512f")))
#else
#define TOFTWIN_SIMD
#endif
