#pragma once

/// Marks what librcs.so offers to programs; all else in it is hidden from them.
#define RCS_API __attribute__((visibility("default")))
