#pragma once

#include <span>
#include <string_view>

namespace km {

/// A file of the page, as it is in the program.
struct PageFile {
  std::string_view path;  ///< Below the page's address: "main.js".
  std::string_view bytes;
};

/// All of the page: those in apps/viewer/page, and three.js where its modules look for each other.
[[nodiscard]] std::span<const PageFile> page_files();

/// What pages of other programs share with it: charts.js, a module that needs no other file, and
/// theme.css. In the library km_charts.
[[nodiscard]] std::span<const PageFile> chart_files();

/// Of the report of a team's run: report.js and report.css. In the library km_report_files.
[[nodiscard]] std::span<const PageFile> report_files();

}  // namespace km
