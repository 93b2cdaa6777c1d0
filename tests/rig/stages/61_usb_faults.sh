# Faults of USB sensors: what can be survived is, and each has its own status.
plug rig_kinect -f "at 6 unplug 700"
check usb.kinect.replug rig_client usb: 20 --reconnects 1 --damaged 3 --log
plug rig_kinect -f "at 3 lost_iso 2" -f "at 6 lost_packet 3" -f "at 9 corrupt_magic" -f "at 12 corrupt_type 1 123"
check usb.kinect.lost_packets rig_client usb: 16 --damaged 16 --damaged-at-least 4 --log
plug rig_kinect -f "at 3 short_packet" -f "at 6 runt_packet 1 5" -f "at 9 corrupt_number" -f "at 12 empty_iso 3"
check usb.kinect.bad_packets rig_client usb: 16 --damaged 16 --damaged-at-least 4 --log
plug rig_kinect -f "at 3 short_frame" -f "at 6 long_frame"
check usb.kinect.bad_frames rig_client usb: 12 --damaged 8 --damaged-at-least 2 --log
plug rig_kinect -f "at 4 silent always"
check usb.kinect.silent rig_client usb: 20 --fails timeout --log
tell clear
check usb.kinect.well_again rig_client usb: 5
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
chmod 755 /
check usb.kinect.denied rig_client usb: 5 --fails denied --uid 65534
for calibration in zero nan negative; do
    plug rig_kinect --calibration $calibration
    check usb.kinect.absurd rig_client usb: 5 --fails format
done
plug rig_ps1080 -f "at 6 unplug 700"
check usb.ps1080.replug rig_client usb: 20 --reconnects 1 --damaged 3 --log
plug rig_ps1080 -f "at 3 bulk_error" -f "at 6 corrupt_size 1 9999" -f "at 9 short_packet" -f "at 12 corrupt_number"
check usb.ps1080.bad_packets rig_client usb: 16 --damaged 16 --damaged-at-least 4 --log
plug rig_ps1080 -f "at 3 corrupt_padding 300" -f "at 9 long_frame" -f "at 12 short_frame"
check usb.ps1080.bad_frames rig_client usb: 16 --damaged 16 --damaged-at-least 3 --log
plug rig_ps1080 -f "at 5 bulk_stall"
check usb.ps1080.bulk_stall rig_client usb: 12 --damaged 8 --restarts 1 --log
plug rig_ps1080 -f "at 3 lost_iso 2" -f "at 6 short_packet" -f "at 9 corrupt_magic"
check usb.ps1080.iso_packets rig_client usb:,iso 14 --damaged 12 --damaged-at-least 3 --log
tell silent_control always
check usb.ps1080.silent_control rig_client usb: 5 --fails timeout
plug rig_ps1080 --calibration huge
check usb.ps1080.absurd rig_client usb: 5 --fails format
