#pragma once

#include "modules/charts/page_file.hpp"

namespace km {

/// All files of the page: those in apps/viewer/page, the parts shared with other programs' pages,
/// and three.js under the names that its modules import.
[[nodiscard]] std::span<const PageFile> page_files();

}  // namespace km
