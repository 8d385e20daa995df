#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/io/json.hpp"

namespace km {

/// A file of a page, embedded in the program.
struct PageFile {
  std::string_view path;  ///< Path below the page's address: "main.js".
  std::string_view bytes;
};

/// Files that pages of several programs share. charts.js is a module that needs no other file.
/// theme.css has the colours of all pages. document.css has the layout of pages that are read from
/// top to bottom, and their colours on paper. chart_page.js shows the plot of a page.
[[nodiscard]] std::span<const PageFile> chart_files();

/// The bytes of the file with that path. Throws std::logic_error if there is none.
[[nodiscard]] std::string_view page_file(std::span<const PageFile> files, std::string_view path);

/// A document for a browser that needs no other file and no network.
struct HtmlPage {
  std::string title;
  std::vector<std::string_view> styles;  ///< Texts, not files; inserted unchanged, like body.
  std::string body;
};

[[nodiscard]] std::string html_page(const HtmlPage& page);

/// A script element with `data`, for scripts that parse the text of the element with this `id`. No
/// text in `data` can end the element. Bytes that are not UTF-8 become the replacement character.
[[nodiscard]] std::string data_script(std::string_view id, const Json& data);

/// A script element with the sources as one module, in this order.
[[nodiscard]] std::string module_script(const std::vector<std::string_view>& sources);

/// "data:image/png;base64,...": the content of a file, in place of its address.
[[nodiscard]] std::string data_uri(std::string_view type, std::string_view bytes);

}  // namespace km
