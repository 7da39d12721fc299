"""Messages of Unitree's C++ SDK, as they came over DDS from far-unitree-sdk 0.1.8; zlib, base 85.

Angles are slot / 100 in both. The command has kp 100, kd 5 and tau 0.5 for every slot.
"""

LOW_CMD = (
    "c-muNzy=tRIra<;C!81<7C4}*;JU7CLs-pXf@=B?eI>#iWm`gO&YtnHC2UtIK{c8&{kBB-i=dh}fjfwB^BIC_*11"
    "0<!e3trs@WmOYDd`b`~=m^nki{VM0^ocQ!S!rM>q^E2&#$ccfzZNQcx3D{ucnPIZev"
)
LOW_STATE = (
    "c-muNzy%uY83=&GUu7H_C<I*Bm2F5<znCQT{fEAiXuh&7DeBLj@v$Y%J*6b6*No}6B{6(RQvW7!2Z{bYLz4P+?hi"
    "=}pRXjT-yz3pM_PFDlcavuOi4Qu(+^4Nt3~weNQ*BElGMlaJJ~S|G4SgR|1JRQ+$Fd"
)
