// SPDX-License-Identifier: MIT
// The source of a program that only has precompiled headers.
int main() {}
