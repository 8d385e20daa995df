#include "modules/charts/html_page.hpp"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "modules/core/io/xml_text.hpp"

namespace km {

std::string_view page_file(std::span<const PageFile> files, std::string_view path) {
  const auto found = std::ranges::find(files, path, &PageFile::path);
  if (found == files.end()) throw std::logic_error("no page file " + std::string(path));
  return found->bytes;
}

std::string html_page(const HtmlPage& page) {
  std::string text =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
      xml_escaped(page.title) + "</title>\n<link rel=\"icon\" href=\"data:,\"/>\n<style>\n";
  for (const std::string_view style : page.styles) text += style;
  return text + "</style>\n</head>\n<body>\n" + page.body + "</body>\n</html>\n";
}

std::string data_script(std::string_view id, const Json& data) {
  std::string text = "<script type=\"application/json\" id=\"" + xml_escaped(id) + "\">";
  // In JSON "<" occurs only in strings, where an escape sequence is equivalent.
  for (const char c : data.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text + "</script>\n";
}

std::string module_script(const std::vector<std::string_view>& sources) {
  std::string text = "<script type=\"module\">\n";
  for (const std::string_view source : sources) text += source;
  return text + "</script>\n";
}

std::string data_uri(std::string_view type, std::string_view bytes) {
  constexpr const char* kBase64Digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "data:" + std::string(type) + ";base64,";
  text.reserve(text.size() + (bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = (group << 8) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kBase64Digits[(group >> (18 - 6 * k)) & 63];
  }
  return text;
}

}  // namespace km
