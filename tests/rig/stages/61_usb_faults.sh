# Faults of USB sensors: each has its own status, and what can be survived is.
plug rig_kinect
tell at 12 unplug 700
check usb.kinect.replug rig_client usb: 30 --reconnects 1 --damaged 3 --log
tell lost_iso 2
check usb.kinect.lost_iso rig_client usb: 12 --damaged 8 --damaged-at-least 1 --log
tell lost_packet 3
check usb.kinect.lost_packet rig_client usb: 12 --damaged 8 --damaged-at-least 1 --log
tell short_packet 2
check usb.kinect.short_packet rig_client usb: 12 --damaged 4 --damaged-at-least 1 --log
tell corrupt_magic 2
check usb.kinect.corrupt_magic rig_client usb: 12 --damaged 4 --damaged-at-least 1 --log
tell corrupt_type 2 123
check usb.kinect.corrupt_type rig_client usb: 12 --damaged 4 --damaged-at-least 1 --log
tell corrupt_number 2
check usb.kinect.corrupt_number rig_client usb: 12 --damaged 8 --damaged-at-least 1 --log
tell short_frame 2
check usb.kinect.short_frame rig_client usb: 12 --damaged 6 --damaged-at-least 1 --log
tell long_frame 2
check usb.kinect.long_frame rig_client usb: 12 --damaged 6 --damaged-at-least 1 --log
tell silent always
check usb.kinect.silent rig_client usb: 5 --fails timeout --log
tell clear
tell silent_control always
check usb.kinect.silent_control rig_client usb: 5 --fails timeout
tell clear
tell stall_control always
check usb.kinect.stall_control rig_client usb: 5 --fails io
tell clear
tell wrong_tag always
check usb.kinect.wrong_tag rig_client usb: 5 --fails format
tell clear
tell wrong_opcode always
check usb.kinect.wrong_opcode rig_client usb: 5 --fails format
tell clear
tell wrong_magic always
check usb.kinect.wrong_magic rig_client usb: 5 --fails format
tell clear
tell wrong_size always 300
check usb.kinect.wrong_size rig_client usb: 5 --fails format
tell clear
tell short_reply always 7
check usb.kinect.short_reply rig_client usb: 5 --fails format
tell clear
tell error_code always 2
check usb.kinect.error_code rig_client usb: 5 --fails unsupported
tell clear
check usb.kinect.denied rig_client usb: 5 --fails denied --uid 65534
check usb.kinect.well_again rig_client usb: 5
plug rig_kinect --calibration zero
check usb.kinect.zero rig_client usb: 5 --fails format
plug rig_kinect --calibration nan
check usb.kinect.nan rig_client usb: 5 --fails format
plug rig_kinect --calibration negative
check usb.kinect.negative rig_client usb: 5 --fails format
plug rig_kinect --calibration huge
check usb.kinect.huge rig_client usb: 5 --fails format
plug rig_ps1080
tell at 12 unplug 700
check usb.ps1080.replug rig_client usb: 30 --reconnects 1 --damaged 3 --log
tell bulk_error 2
check usb.ps1080.bulk_error rig_client usb: 12 --damaged 8 --damaged-at-least 1 --log
tell bulk_stall 1
check usb.ps1080.bulk_stall rig_client usb: 12 --damaged 8 --restarts 1 --log
tell corrupt_size 2 9999
check usb.ps1080.corrupt_size rig_client usb: 12 --damaged 8 --damaged-at-least 1 --log
tell corrupt_padding 2
check usb.ps1080.corrupt_padding rig_client usb: 12 --damaged 4 --log
tell short_packet 2
check usb.ps1080.short_packet rig_client usb: 12 --damaged 8 --damaged-at-least 1 --log
tell lost_iso 2
check usb.ps1080.lost_iso rig_client usb:,iso 12 --damaged 8 --damaged-at-least 1 --log
tell short_packet 2
check usb.ps1080.iso_short rig_client usb:,iso 12 --damaged 8 --damaged-at-least 1 --log
tell silent_control always
check usb.ps1080.silent_control rig_client usb: 5 --fails timeout
tell clear
check usb.ps1080.descriptor rig_client usb: 5 --fd $(ls /dev/bus/usb/001/* | tail -n 1)
check usb.ps1080.cycles rig_client usb: 1 --cycles 20
plug rig_ps1080 --calibration nan
check usb.ps1080.nan rig_client usb: 5 --fails format
plug rig_ps1080 --id 2bc5:0401
check usb.astra rig_client usb:2bc5:0401 5
