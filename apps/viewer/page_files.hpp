#pragma once

#include "modules/charts/page_file.hpp"

namespace km {

/// All of the page: those in apps/viewer/page, what it shares with other programs' pages, and
/// three.js where its modules look for each other.
[[nodiscard]] std::span<const PageFile> page_files();

}  // namespace km
