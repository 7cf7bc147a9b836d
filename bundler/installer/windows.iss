; A setup program for Windows, by Inno Setup 6: iscc /DVersion=1.2.3 /DFiles=UNPACKED-ARCHIVE windows.iss
; Without an administrator it installs for one user, into the folders that README.txt names; with one, for all.

[Setup]
AppId={{6E0C5B0D-3E0B-4E53-8E55-0C1B3A6C5C11}
AppName=Promenade
AppVersion={#Version}
AppPublisher=Promenade
DefaultDirName={autopf}\Promenade
DisableProgramGroupPage=yes
PrivilegesRequired=lowest
PrivilegesRequiredOverridesAllowed=dialog
ArchitecturesAllowed=x64compatible
ArchitecturesInstallIn64BitMode=x64compatible
LicenseFile={#Files}\LICENSE-MIT
Compression=lzma2
SolidCompression=yes

[Files]
Source: "{#Files}\Promenade.clap"; DestDir: "{autocf}\CLAP"; Flags: ignoreversion
Source: "{#Files}\Promenade.vst3\*"; DestDir: "{autocf}\VST3\Promenade.vst3"; Flags: ignoreversion recursesubdirs
Source: "{#Files}\presets\*"; DestDir: "{userdocs}\VST3 Presets\Promenade\Promenade"
Source: "{#Files}\scenes\*"; DestDir: "{autoappdata}\promenade\scenes"
Source: "{#Files}\bin\*"; DestDir: "{app}"; Flags: ignoreversion
Source: "{#Files}\manual\*"; DestDir: "{app}\manual"; Flags: recursesubdirs
Source: "{#Files}\licenses\*"; DestDir: "{app}\licenses"; Flags: recursesubdirs
Source: "{#Files}\examples\*"; DestDir: "{app}\examples"
Source: "{#Files}\LICENSE-*"; DestDir: "{app}"
Source: "{#Files}\*.md"; DestDir: "{app}"

[Icons]
Name: "{autoprograms}\Promenade"; Filename: "{app}\promenade-standalone.exe"; Check: FileExists(ExpandConstant('{app}\promenade-standalone.exe'))
Name: "{autoprograms}\Promenade, manual"; Filename: "{app}\manual\index.html"
