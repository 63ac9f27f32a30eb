#pragma once

#include <string>

#include "options/options.h"

namespace pellicle::options {

/// The text of `-help`: purpose and call of the program, and every option by module; lines of up to 100 letters.
std::string help_text(const OptionTable& table);

/// The text of `-options_table`: Markdown, one table a module.
std::string options_markdown(const OptionTable& table);

}  // namespace pellicle::options
