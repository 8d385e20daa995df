#pragma once

#include <span>
#include <string_view>

namespace km {

/// A file of a page, as it is in the program.
struct PageFile {
  std::string_view path;  ///< Below the page's address: "main.js".
  std::string_view bytes;
};

/// What pages of several programs share: charts.js, a module that needs no other file; theme.css,
/// the colours of all pages; document.css, of those that are read from top to bottom, on paper,
/// too; chart_page.js.
[[nodiscard]] std::span<const PageFile> chart_files();

/// The bytes of the one of that path. Throws std::logic_error if there is none.
[[nodiscard]] std::string_view page_file(std::span<const PageFile> files, std::string_view path);

}  // namespace km
