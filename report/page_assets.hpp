/// Style sheet and script of the report's page: the contents of report/page/page.css and page.js.
/// Internal to report/.
#pragma once

#include <string_view>

namespace tiltrim {

extern const std::string_view page_style, page_script;

}  // namespace tiltrim
