#pragma once

#include <span>
#include <string_view>

namespace km {

/// A file of a page, embedded in the program.
struct PageFile {
  std::string_view path;  ///< Path below the page's address: "main.js".
  std::string_view bytes;
};

/// Files that pages of several programs share. charts.js is a module that needs no other file.
/// theme.css has the colours of all pages. document.css has the layout of pages that are read from
/// top to bottom, and their colours on paper. chart_page.js shows the plots of a page.
[[nodiscard]] std::span<const PageFile> chart_files();

/// The bytes of the file with that path. Throws std::logic_error if there is none.
[[nodiscard]] std::string_view page_file(std::span<const PageFile> files, std::string_view path);

}  // namespace km
