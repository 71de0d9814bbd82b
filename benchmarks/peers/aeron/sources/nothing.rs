// SPDX-License-Identifier: MIT
//! Empty: cargo wants a target.
