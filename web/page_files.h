// PageFile: the gallery page's files as they are served, compressed when the program is built.
// Realises doc/design.md, section 6: one binary with the page embedded.
// It must not know who serves the files, nor how.
#pragma once

#include <span>
#include <string_view>

namespace retake {

/// One file of the page. All views last as long as the program.
struct PageFile {
  std::string_view path;          ///< where it is served: "/", "/app/main.js", "/vendor/three.module.js"
  std::string_view content_type;  ///< with its charset, ready for the header
  std::string_view etag;          ///< of the content, without quotes
  std::string_view gzip;          ///< the content, compressed with gzip
};

/// Every file of the page, sorted by path. Thread safety: any thread.
std::span<const PageFile> page_files();

}  // namespace retake
