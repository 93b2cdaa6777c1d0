// SPDX-License-Identifier: MIT
// Inside of the room: what each format offers to open.cpp. A new format is one file, one line here and one in
// the table of open.cpp.
#pragma once

#include <memory>
#include <string>

#include "capture/dataset.h"

namespace burin {

// looks_like_*: cheap, by the names in the folder. open_*: the folder is there; errors name the file.
bool looks_like_tum(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_tum(const std::string& folder);

bool looks_like_icl_nuim(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_icl_nuim(const std::string& folder);

bool looks_like_seven_scenes(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_seven_scenes(const std::string& folder);

bool looks_like_replica(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_replica(const std::string& folder);

bool looks_like_redwood(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_redwood(const std::string& folder);

bool looks_like_slambook(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_slambook(const std::string& folder);

bool looks_like_stray(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_stray(const std::string& folder);

bool looks_like_polycam(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_polycam(const std::string& folder);

// Data sets that are one file.
bool looks_like_sens(const std::string& path);
Result<std::unique_ptr<Dataset>> open_sens(const std::string& path);

bool looks_like_klg(const std::string& path);
Result<std::unique_ptr<Dataset>> open_klg(const std::string& path);

// Only where libzip was found (BURIN_HAVE_ZIP).
bool looks_like_record3d(const std::string& path);
Result<std::unique_ptr<Dataset>> open_record3d(const std::string& path);

bool looks_like_recording(const std::string& folder);
Result<std::unique_ptr<Dataset>> open_recording(const std::string& folder);

}  // namespace burin
