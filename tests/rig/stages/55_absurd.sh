# Descriptors and calibration that make no sense: the kernel refuses them or not, but stays whole (kernel.quiet at the end).
plug rig_uvc_camera --absurd zero-size
check absurd.uvc.zero_size calm
plug rig_uvc_camera --absurd huge-size
check absurd.uvc.huge_size calm
plug rig_uvc_camera --absurd zero-interval
check absurd.uvc.zero_interval calm
plug rig_uvc_camera --absurd no-formats
check absurd.uvc.no_formats calm
plug rig_uvc_camera --absurd no-endpoint
check absurd.uvc.no_endpoint calm
plug rig_uvc_camera --absurd cut
check absurd.uvc.cut calm
