// SPDX-License-Identifier: MIT
// The source of a target that only has precompiled headers.
