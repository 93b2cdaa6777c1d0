// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/dataset.h"

namespace burin {

// The formats that open_dataset knows, as `--format` takes them.
std::vector<std::string> dataset_formats();

// Opens a recorded data set. `format` is one of dataset_formats(), or empty to recognise it from the files
// that are there. Errors name the folder and what was expected of it.
Result<std::unique_ptr<Dataset>> open_dataset(const std::string& path, const std::string& format);

}  // namespace burin
