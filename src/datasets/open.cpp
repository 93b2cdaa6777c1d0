// SPDX-License-Identifier: MIT
#include "datasets/open.h"

namespace burin {

std::vector<std::string> dataset_formats() { return {}; }

Result<std::unique_ptr<Dataset>> open_dataset(const std::string& path, const std::string&) {
    return Status::error(Code::unsupported, "%s: no data set format is built in", path.c_str());
}

}  // namespace burin
