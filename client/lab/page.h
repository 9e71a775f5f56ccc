// The fixed parts of a report's page: CSS, script, and pictures as data URIs. Other reports may use them.
#pragma once

#include <string>
#include <string_view>

namespace lightmill::lab {

/// "data:image/png;base64,…".
std::string png_data_uri(std::string_view png);

/// CSS of the page, light and dark, with that of charts.
std::string page_css();

/// The script of the page. A click enlarges all pictures of a section around the same point. A checkbox shows the
/// differences.
std::string page_script();

}  // namespace lightmill::lab
